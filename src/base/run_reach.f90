!> How far the one run of a scene has come, for who watches it: time simulated over duration.
module run_reach
   use, intrinsic :: iso_c_binding, only: c_double, c_loc, c_ptr
   use kinds, only: wp
   implicit none (type, external)
   private
   public :: watch_reach, forget_reach, tell_reach, place_of_reach

   !> 0 to 1; a timer reads it at any moment
   real(c_double), volatile, target :: reach = 0.0_c_double
   !> One run of one thread is looked at; sweeps count their cases
   logical :: is_watched = .false.

contains

   !> From now on a run tells how far it is.
   subroutine watch_reach()
      reach = 0.0_c_double
      is_watched = .true.
   end subroutine watch_reach

   !> No run tells it any more.
   subroutine forget_reach()
      is_watched = .false.
      reach = 0.0_c_double
   end subroutine forget_reach

   !> So far is the run that is watched, if one is.
   subroutine tell_reach(time, duration)
      real(wp), intent(in) :: time
      real(wp), intent(in) :: duration

      if (is_watched) reach = real(time/duration, c_double)
   end subroutine tell_reach

   !> Where the fraction is, for what is not written in Fortran.
   function place_of_reach() result(place)
      type(c_ptr) :: place

      place = c_loc(reach)
   end function place_of_reach

end module run_reach
