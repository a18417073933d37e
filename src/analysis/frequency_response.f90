!> Frequency response of the beam without contact to harmonic loads: complex amplitudes of the steady-state motion, in
!> closed form from the modes (docs/theory.md, section 21). Frequencies are in omega1, displacements in D.
module frequency_response
   use analysis_types, only: analysis_t
   use applied_loads, only: applied_loads_t, count_forces, courses_of, gather_loads
   use beam_model, only: beam_model_t
   use body_modes, only: damping_rate_of, squared_frequency_of
   use failures, only: failure_t
   use few_modes, only: find_modes_of_run
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_settings, only: base_displacement, course_harmonic, time_course_t
   use mode_choice, only: rates_of_modes
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: frequency_response_settings_t, scene_t
   use stop_contacts, only: contact_t, contacts_of
   implicit none (type, external)
   private
   public :: frequency_response_t

   !> Complex amplitudes of the displacements, relative to the base, under loads sin(omega tau + phase). A displacement
   !> is the imaginary part of amplitude exp(i omega tau).
   type, extends(analysis_t) :: frequency_response_t
      !> Frequency omega of the loads over omega1, [frequencies]
      real(wp), allocatable :: frequency(:)
      !> Amplitude of the beam at the tip, [frequencies]
      complex(wp), allocatable :: tip(:)
      !> Amplitude of the beam at each contact in the scene's order, less that of the body there; of a body at its floor
      !> or ceiling, [contacts, frequencies]
      complex(wp), allocatable :: stop(:, :)
      !> Amplitude of each body, which moves alone on its spring and damper, [bodies, frequencies]
      complex(wp), allocatable :: body(:, :)
   contains
      procedure :: compute
      procedure :: write => write_group
   end type frequency_response_t

contains

   !> Compute the response at each frequency to all harmonic loads together, each with its amplitude and phase.
   subroutine compute(self, scene, model, settings, response, error)
      class(frequency_response_t), intent(inout) :: self
      !> The scene, with the group &frequency_response
      type(scene_t), intent(in) :: scene
      !> The beam
      type(beam_model_t), intent(in) :: model
      !> Its loads, stops and damping
      type(run_settings_t), intent(in) :: settings
      !> Not used
      type(response_t), intent(in) :: response
      !> Set if the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: modes
      type(applied_loads_t) :: loads
      type(contact_t), allocatable :: contacts(:)
      real(wp), allocatable :: damping(:), force(:, :)
      complex(wp), allocatable :: coordinate(:)
      integer :: bodies, i, k, mode_count

      call find_modes_of_run(model, settings, modes, error)
      if (allocated(error)) return
      mode_count = size(modes%square)
      ! a given number of modes excludes residual modes, and the higher modes of a small mesh
      if (settings%response%mode_count > 0) mode_count = min(mode_count, settings%response%mode_count)
      allocate (contacts, source=contacts_of(settings))
      call gather_loads(model, settings, loads)
      force = matmul(transpose(modes%mode(:, :mode_count)), loads%vector(:size(modes%mode, 1), :))
      ! coefficient 2 zeta W^2 + alpha of each modal velocity
      damping = 2.0_wp*settings%zeta*modes%square(:mode_count) + rates_of_modes(settings, modes%square(:mode_count))
      associate (unused => response, points => scene%frequency_response%points)
         self%frequency = frequencies_of(scene%frequency_response)
         bodies = 0
         if (allocated(settings%bodies)) bodies = size(settings%bodies)
         allocate (self%tip(points), self%stop(size(contacts), points), self%body(bodies, points))
      end associate
      do i = 1, size(self%frequency)
         associate (omega => self%frequency(i), amplitude => amplitudes_at(settings, self%frequency(i)))
            coordinate = matmul(force, amplitude)/cmplx(modes%square(:mode_count) - omega**2, omega*damping, wp)
            do k = 1, bodies
               associate (body => settings%bodies(k))
                  self%body(k, i) = sum(loads%vector(size(loads%vector, 1) - bodies + k, :)*amplitude) &
                     /(body%mass_ratio*cmplx(squared_frequency_of(body) - omega**2, omega*damping_rate_of(body), wp))
               end associate
            end do
         end associate
         self%tip(i) = sum(modes%mode(modes%tip_dof, :mode_count)*coordinate)
         do k = 1, size(contacts)
            associate (dof => model%stop_dofs(contacts(k)%stop), number => contacts(k)%number, &
               body => contacts(k)%settings%body)
               self%stop(number, i) = (0.0_wp, 0.0_wp)
               if (.not. contacts(k)%settings%is_of_base) self%stop(number, i) = sum(modes%mode(dof, &
                  :mode_count)*coordinate)
               if (body > 0) self%stop(number, i) = self%stop(number, i) &
                  + merge(1.0_wp, -1.0_wp, contacts(k)%settings%is_of_base)*self%body(body, i)
            end associate
         end do
      end do
   end subroutine compute

   !> Equally or logarithmically spaced frequencies; both ends of the range are exact.
   pure function frequencies_of(settings) result(frequency)
      type(frequency_response_settings_t), intent(in) :: settings
      real(wp) :: frequency(settings%points)

      integer :: i

      associate (lowest => settings%range(1), highest => settings%range(2), last => real(settings%points - 1, wp))
         if (settings%is_logarithmic) then
            frequency = [(lowest*(highest/lowest)**(real(i, wp)/last), i=0, settings%points - 1)]
         else
            frequency = [(lowest + (highest - lowest)*(real(i, wp)/last), i=0, settings%points - 1)]
         end if
         frequency(settings%points) = highest
      end associate
   end function frequencies_of

   !> Complex amplitudes of all loads at a frequency, in the order of `gather_loads`; zero for loads that are not
   !> harmonic.
   pure function amplitudes_at(settings, omega) result(amplitude)
      type(run_settings_t), intent(in) :: settings
      !> Frequency of all loads, over omega1
      real(wp), intent(in) :: omega
      complex(wp), allocatable :: amplitude(:)

      type(time_course_t), allocatable :: courses(:)
      integer :: forces, k

      allocate (courses, source=courses_of(settings))
      ! a load is the imaginary part of amplitude exp(i omega tau)
      amplitude = merge(cmplx(courses%amplitude*cos(courses%phase), courses%amplitude*sin(courses%phase), wp), &
         (0.0_wp, 0.0_wp), courses%kind == course_harmonic)
      forces = count_forces(settings)
      ! the load of a moving base is its acceleration
      do k = forces + 1, size(courses)
         if (settings%bases(k - forces)%quantity == base_displacement) amplitude(k) = -omega**2*amplitude(k)
      end do
   end function amplitudes_at

   !> Write the response of the displacements at each frequency: amplitudes and phases.
   subroutine write_group(self, group)
      class(frequency_response_t), intent(in) :: self
      type(quantity_group_t), intent(in) :: group

      character(*), parameter :: at_stops = 'surface omega', of_bodies = 'body omega'
      integer :: k

      call group%attribute('meaning', 'displacements, relative to the base, of the beam with its stops open: ' &
         //'amplitude times sin(omega t + phase), where loads have their amplitudes and phases, all at omega')
      call group%put('omega', self%frequency, 'frequency', '{omega over omega1~frequency of the loads}', &
         is_scale=.true.)
      call group%put('amplitude_tip', abs(self%tip), 'displacement', 'amplitude of the tip', 'omega')
      call group%put('phase_tip', degrees(self%tip), 'number', 'its phase in degrees', 'omega')
      if (size(self%body, 1) > 0) then
         call group%put('body', [(k, k=1, size(self%body, 1))], 'body, in the order of &body', is_scale=.true.)
         call group%put('amplitude_body', abs(self%body), 'displacement', &
            'amplitude of the body alone on its spring and damper', of_bodies)
         call group%put('phase_body', degrees(self%body), 'number', 'its phase in degrees', of_bodies)
      end if
      if (size(self%stop, 1) == 0) return
      call group%put('surface', [(k, k=1, size(self%stop, 1))], &
         'surface, in the order of &stop and &body, below before above', is_scale=.true.)
      call group%put('amplitude_stop', abs(self%stop), 'displacement', &
         'amplitude of the beam there, relative to the body if it is one; at floor and ceiling that of the body', &
         at_stops)
      call group%put('phase_stop', degrees(self%stop), 'number', 'its phase in degrees', at_stops)
   end subroutine write_group

   !> Phase of a complex amplitude in degrees; 0 if the amplitude is 0.
   elemental function degrees(amplitude) result(phase)
      complex(wp), intent(in) :: amplitude
      real(wp) :: phase

      phase = atan2(aimag(amplitude), real(amplitude, wp))*(180.0_wp/acos(-1.0_wp))
   end function degrees

end module frequency_response
