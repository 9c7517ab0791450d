"""proto"""
from __future__ import annotations
import numpy as np, time
from scipy.optimize import least_squares
from baselines.identification.quantities import *
from baselines.identification.starts import *
class Problem:
    def __init__(self, windows, noise, rig, quantities):
        self.w,self.noise,self.rig,self.q=windows,noise,rig,quantities
        self.centre=coordinates(rig,quantities); self.spread=np.array([q.spread for q in quantities])
        self.free=np.zeros((len(windows.starts),14)); self.key=None; self.nf=0; self.slopes=None
    def at(self,theta):
        if self.key is None or not np.array_equal(self.key,theta):
            self.settled=settle(self.w,self.noise,rig_at(self.rig,self.q,theta),self.free,self.slopes); self.key=theta.copy(); self.nf+=1
            print('   f',self.nf,(self.settled[1]**2).sum()/self.settled[1].size,time.time()-T0,flush=True)
        return self.settled
    def fun(self,theta):
        s=self.at(theta)
        return np.concatenate([s[1].ravel(),(theta-self.centre)/self.spread])
    def jac(self,theta):
        free,res=self.at(theta); self.free=free
        rig=rig_at(self.rig,self.q,theta)
        self.slopes=slopes_at(self.w,self.noise,rig,free)
        h=1e-5
        Q=len(theta)
        rigs=[rig_at(self.rig,self.q,theta+h*np.eye(Q)[k]) for k in range(Q)]
        f=predicted(self.w,self.noise,rigs,np.repeat(free[None],Q,0))
        J=self.slopes.unexplained(((f-res)/h).transpose(1,2,0))
        self.Jw=J; self.res=res
        return np.concatenate([J.reshape(-1,Q),np.diag(1/self.spread)])
T0=time.time()
